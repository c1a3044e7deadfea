function z({texture:h,factor:t,blends:s,cutoff:r,twoSided:e,extras:i}){return[h,t,s,r,e,i].join()}function*F(h){let t=new Map;for(let p of h){let x=z(p),g=t.get(x);g?g.push(p):t.set(x,[p])}let s=h.reduce((p,{positions:x})=>p+x.length/3,0),r=h.reduce((p,{indices:x})=>p+x.length,0),e=h.some(({spots:p})=>p),i=h.some(({colors:p})=>p),o=5+2*+e+ +i,n=new Float32Array(o*s),a=new Uint8Array(n.buffer),l=s>65535?new Uint32Array(r):new Uint16Array(r),m=[],c=0,E=0;for(let p of t.values()){let x=E;for(let{positions:w,uvs:y,colors:T,spots:A,indices:f}of p){yield;for(let d=0;d<f.length;d++)d%16384===16383&&(yield),l[E++]=c+f[d];for(let d=0;d<w.length/3;d++,c++){d%16384===16383&&(yield);for(let u=0;u<3;u++)n[o*c+u]=w[3*d+u];for(let u=0;i&&u<4;u++)a[4*(o*(c+1)-1)+u]=T?255*U(T[4*d+u]/65535)+.5:255;for(let u=0;u<2;u++)y&&(n[o*c+3+u]=y[2*d+u]),A&&(n[o*c+5+u]=A[2*d+u])}}let[g]=p,v=[...g.factor.slice(0,3).map(U),g.factor[3]];for(let w=x;w<E;w+=6144){let y=l.subarray(w,Math.min(w+6144,E)),T=W(y,n,o);m.push({look:g,first:w*l.BYTES_PER_ELEMENT,count:y.length,color:v,...T}),yield}}return{data:n,lit:e,painted:i,index:l,batches:m}}function W(h,t,s){let r=[1/0,1/0,1/0],e=[-1/0,-1/0,-1/0];for(let i=0;i<h.length;i++)for(let o=0,n=s*h[i];o<3;o++,n++)t[n]<r[o]&&(r[o]=t[n]),t[n]>e[o]&&(e[o]=t[n]);return{low:r,high:e}}var R=class{constructor(t,{data:s,lit:r,painted:e,index:i,batches:o},n){this.gl=t,this.shapes=n,this.batches=o,this.bytes=s.byteLength+i.byteLength,this.type=i instanceof Uint32Array?t.UNSIGNED_INT:t.UNSIGNED_SHORT,this.vertexArray=t.createVertexArray(),this.buffers=[t.createBuffer(),t.createBuffer()],t.bindVertexArray(this.vertexArray),t.bindBuffer(t.ARRAY_BUFFER,this.buffers[0]),t.bufferData(t.ARRAY_BUFFER,s,t.STATIC_DRAW),t.bindBuffer(t.ELEMENT_ARRAY_BUFFER,this.buffers[1]),t.bufferData(t.ELEMENT_ARRAY_BUFFER,i,t.STATIC_DRAW);let a=r?28:20,l=a+4*+e,m=(c,E,p)=>{t.enableVertexAttribArray(c),t.vertexAttribPointer(c,E,E<4?t.FLOAT:t.UNSIGNED_BYTE,E>3,l,p)};m(0,3,0),m(1,2,12),t.vertexAttrib4f(2,1,1,1,1),e&&m(2,4,a),r&&m(3,2,20),t.bindVertexArray(null)}draw(t){this.gl.drawElements(this.gl.TRIANGLES,t.count,this.type,t.first)}delete(){this.gl.deleteVertexArray(this.vertexArray);for(let t of this.buffers)this.gl.deleteBuffer(t)}};function U(h){return h<=.0031308?12.92*h:1.055*h**(1/2.4)-.055}var I=(h="",t="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${h}
void main(){
${t}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,j=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,$=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${j}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,L=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,q=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${L}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,J=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${L}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,C={surface:[I(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),$],item:[I(),q],placeholder:[I(),J]};function P(h,t,s=C[t]){let r=h.createProgram(),e=[h.VERTEX_SHADER,h.FRAGMENT_SHADER];if(s.forEach((n,a)=>{let l=h.createShader(e[a]);h.shaderSource(l,n),h.compileShader(l),h.attachShader(r,l),h.deleteShader(l)}),h.linkProgram(r),!h.getProgramParameter(r,h.LINK_STATUS)&&!h.isContextLost())throw new Error(`${t}: ${h.getProgramInfoLog(r)}`);let i={},o=h.isContextLost()?0:h.getProgramParameter(r,h.ACTIVE_UNIFORMS);for(let n=0;n<o;n++){let a=h.getActiveUniform(r,n)?.name??"";i[a]=h.getUniformLocation(r,a)}return{program:r,at:i}}function B(h,{program:t,at:s},r){h.useProgram(t),h.uniform3fv(s.eye,r.eye),h.uniformMatrix3fv(s.turn,!1,r.turn),h.uniform4fv(s.lens,r.lens)}var O=[.16,.17,.19,1],M=class{cells=new Map;#t=new Map;constructor(t,s,r){this.gl=t,this.memory=s,this.means=r.map(({color:e})=>e.map(i=>i/255)),this.surface=P(t,"surface"),this.baked=r.some(e=>"light"in e),this.statues=null}add(t,s,r){let e=this.#t.get(t)??{shapes:s,steps:F(s)};this.#t.set(t,e);let{steps:i}=e,o=i.next();for(;!o.done;){if(r())return!1;o=i.next()}return this.#t.delete(t),this.cells.get(t)?.delete(),this.cells.set(t,new R(this.gl,o.value,e.shapes)),!0}keep(t){for(let[s,r]of this.cells)t.has(s)||(r.delete(),this.cells.delete(s));for(let s of this.#t.keys())t.has(s)||this.#t.delete(s)}delete(){this.keep(new Set),this.gl.deleteProgram(this.surface.program)}get bytes(){let t=0;for(let{bytes:s}of this.cells.values())t+=s;return t}draw(t,s,r){let{gl:e,surface:i}=this;e.clearColor(O[0],O[1],O[2],1),e.depthMask(!0),e.clear(e.COLOR_BUFFER_BIT|e.DEPTH_BUFFER_BIT),e.enable(e.DEPTH_TEST),e.disable(e.BLEND),B(e,i,t);let o=!1,n=[],a=[];for(let{buffers:l,batches:m}of s){e.bindVertexArray(l.vertexArray);for(let c of m)c.look.blends?n.push({buffers:l,batch:c,far:Q(t.eye,c)}):this.statues?.has(c.look)?a.push({buffers:l,batch:c}):o=this.#e(l,c,r)||o}if(a.length){let l=(m,c)=>this.#s(m,c,r);o=this.statues?.draw(t,a,l,r)||o,e.useProgram(i.program)}if(n.length){e.enable(e.BLEND),e.blendFuncSeparate(e.SRC_ALPHA,e.ONE_MINUS_SRC_ALPHA,e.ONE,e.ONE_MINUS_SRC_ALPHA),e.depthMask(!1);for(let{buffers:l,batch:m}of n.sort((c,E)=>E.far-c.far))e.bindVertexArray(l.vertexArray),o=this.#e(l,m,r)||o;e.depthMask(!0)}return e.bindVertexArray(null),o}#e(t,s,r){let e=this.#s(this.surface.at,s,r);return t.draw(s),e}#s(t,s,r){let{gl:e}=this,{texture:i,light:o,clampU:n,clampV:a,cutoff:l,twoSided:m}=s.look;(m?e.disable:e.enable).call(e,e.CULL_FACE),e.uniform4fv(t.color,s.color),e.uniform1f(t.cutoff,l),e.uniform1i(t.textured,+(i>=0));let c=i<0?null:this.memory.of(i);e.uniform1i(t.channels,c?.channels??0),i>=0&&e.uniform3fv(t.mean,this.means[i]);let E=!1,p=+this.baked;if(o>=0){let x=this.memory.of(o);e.activeTexture(e.TEXTURE1),E=x?.bind(!0,!0,r)??!1,e.activeTexture(e.TEXTURE0),e.uniform1i(t.lightmap,1),p=x?-1:Math.max(this.means[o][0],.001)}return e.uniform1f(t.lit,p),c?.bind(n,a,r)||E}};function Q(h,{low:t,high:s}){return Math.hypot(...h.map((r,e)=>(t[e]+s[e])/2-r))}function G(h,t,s){if(!s)return h;let r=new Uint8ClampedArray(h),e=t-+(t>1);for(let i=0;i<r.length;i+=t)for(let o=i;o<i+e;o++)r[o]+=s;return new Uint8Array(r.buffer)}var Z=262144,tt=.3;function H(h,t){return t===1?{inside:h.R8,outside:h.RED}:t===2?{inside:h.RG8,outside:h.RG}:{inside:h.RGBA8,outside:h.RGBA}}var N=class{#t=0;#e=0;#s=-1;constructor(t,s,r){this.gl=t,this.sizes=s,this.channels=r,this.texture=t.createTexture(),this.bytes=s.reduce((o,{width:n,height:a})=>o+n*a*r,0);let{width:e,height:i}=s[s.length-1];t.bindTexture(t.TEXTURE_2D,this.texture),t.texStorage2D(t.TEXTURE_2D,s.length,H(t,r).inside,e,i),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.LINEAR_MIPMAP_LINEAR),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.LINEAR)}get levels(){return this.sizes.length}upload(t,s,r,e){let{gl:i,channels:o}=this,{width:n,height:a}=this.sizes[t],l=Math.min(a-r,Math.max(1,Math.floor(Z/(n*o)))),m=s.subarray(r*n*o,(r+l)*n*o);return i.bindTexture(i.TEXTURE_2D,this.texture),i.pixelStorei(i.UNPACK_ALIGNMENT,1),i.texSubImage2D(i.TEXTURE_2D,this.levels-1-t,0,r,n,l,H(i,o).outside,i.UNSIGNED_BYTE,G(m,o,e)),r+l}fadeIn(t,s){this.#t=t,this.#e=s}bind(t,s,r){let{gl:e}=this,i=+t+2*+s;if(e.bindTexture(e.TEXTURE_2D,this.texture),i!==this.#s){let[n,a]=[t,s].map(l=>l?e.CLAMP_TO_EDGE:e.REPEAT);e.texParameteri(e.TEXTURE_2D,e.TEXTURE_WRAP_S,n),e.texParameteri(e.TEXTURE_2D,e.TEXTURE_WRAP_T,a),this.#s=i}if(!this.#t)return!1;let o=this.#t*Math.max(0,1-(r-this.#e)/tt);return e.texParameterf(e.TEXTURE_2D,e.TEXTURE_MIN_LOD,o>0?o:-1e3),o===0&&(this.#t=0),o>0}delete(){this.gl.deleteTexture(this.texture)}};var et=3,st=6,D=class{images=null;loss=0;storage=null;level=0;row=0;constructor(t,s){this.texture=t,this.to=s,this.inside=!1}},_=class{#t;#e=new Map;#s=new Int32Array(0);#c=new Float64Array(0);#i;#r;constructor(t,s,r){this.gl=t,this.rows=s,this.decode=r,this.#t=s.map(()=>null),this.held=new Int32Array(s.length),this.loss=new Float64Array(s.length),this.#i=new Float64Array(s.length),this.#r=new Int32Array(s.length),this.budget=1/0,this.bytes=0,this.peak=0,this.fades=!0}of(t){return this.#t[t]}settle(t,s,r){this.#s=t,this.#i=r,this.#r.fill(0),this.#c=s;for(let n=0;n<t.length;n++)t[n]===0&&this.held[n]&&this.#h(n);let e=[...t.keys()].filter(n=>this.held[n]>t[n]);e.sort((n,a)=>s[n]-s[a]);let i=[...this.#e.values()].some(({storage:n,inside:a})=>n&&!a),o=Math.min(...e.map(n=>this.#l(n,t[n])));for(let n of e){if(this.bytes<=this.budget&&(i||this.bytes+o<=this.budget))break;this.#h(n)}this.#o()}hold(){this.#s=this.held.map((t,s)=>Math.max(t,Math.min(this.#s[s]??0,this.#r[s]))),this.#i=this.loss.slice()}resume(){this.#o()}#u(t,s){let r=-1;for(let e=0;e<this.rows.length;e++)t(e)&&(r<0||s(e)>s(r))&&(r=e);return r}#d(t){return this.held[t]>0&&this.held[t]===this.#s[t]&&this.#i[t]<this.loss[t]}#a(t){let s=this.held[t],r=this.#s[t];return r<s?2:s===0?1:r>s?0:-1}#o(){let{held:t}=this,s=this.#s,r=this.#c;for(;;){let e=[...this.#e.values()];if(e.filter(({images:a})=>!a).length>=et)return;let i=e.length<st,o=this.#u(a=>s[a]>0&&!this.#e.has(a)&&(s[a]<t[a]||i&&(s[a]>t[a]||this.#d(a))),a=>r[a]+this.#a(a));if(o<0)return;let n=new D(o,s[o]);this.#e.set(o,n),this.decode(o,s[o]).then(({images:a,loss:l})=>{Object.assign(n,{images:a,loss:l}),this.#o()},()=>this.#n(n))}}#n(t){this.#e.get(t.texture)===t&&(t.storage&&!t.inside&&this.#f(t.storage),this.#e.delete(t.texture))}#h(t){let s=this.#t[t];s&&this.#f(s),this.#t[t]=null,this.held[t]=0}pump(t,s){let r=!1,e=[...this.#e.values()];e.sort((i,o)=>this.#a(o.texture)-this.#a(i.texture));for(let i of e){for(;!s()&&this.#m(i,t);)r=!0;if(s())break}return r&&this.#o(),r}#m(t,s){let{texture:r,to:e,images:i,loss:o}=t,n=this.held[r],{offsets:a}=this.rows[r];if(!i||this.#e.get(r)!==t)return!1;let l=this.#s[r],m=e===n&&o<this.loss[r];if(l===0||e>l||e<=n&&l>=n&&!m)return this.#n(t),!1;t.storage||(t.inside=m,t.storage=m?this.#t[r]:this.#p(r,e));let{storage:c}=t;if(!c||t.inside&&c!==this.#t[r])return c&&this.#n(t),!1;let{level:E,row:p}=t,{data:x,height:g}=i[E];return t.row=c.upload(E,x,p,a[E]),t.row>=g&&(t.row=0,t.level++),t.level<e||(this.#e.delete(r),this.loss[r]=o,t.inside)||(this.#h(r),this.#t[r]=c,this.held[r]=e,this.fades&&n>0&&e>n&&c.fadeIn(e-n,s)),!0}#p(t,s){let{sizes:r,channels:e}=this.rows[t],i=this.#l(t,s),o=s<this.held[t]?0:this.#E();return this.bytes+i+o>this.budget?null:(this.bytes+=i,this.peak=Math.max(this.peak,this.bytes),new N(this.gl,r.slice(0,s),e))}#l(t,s){let{sizes:r,channels:e}=this.rows[t];return r.slice(0,s).reduce((i,o)=>i+o.width*o.height*e,0)}#E(){return this.#s.reduce((t,s,r)=>s<this.held[r]?Math.max(t,this.#l(r,s)):t,0)}#f(t){this.bytes-=t.bytes,t.delete()}delete(){this.#s=new Int32Array(this.rows.length);for(let t of[...this.#e.values()])this.#n(t);for(let t=0;t<this.rows.length;t++)this.#h(t)}lose(){this.#r=this.held.map((t,s)=>Math.max(t,this.#r[s])),this.#t.fill(null),this.#e.clear(),this.held.fill(0),this.bytes=0}};function K(h,t){let s=0,r=0;for(let i of t)s+=Math.max(i.left,0),r+=+!i.waits;let e=h.latency+.2/2;return r<h.concurrency&&(s===0||8*s<e*h.bandwidth)}var V=class{constructor(t){let{gl:s,rows:r,stream:e,index:i}=t;this.walk=t,this.memory=new _(s,r,(o,n)=>e.decode(o,n)),this.memory.fades=!1,this.renderer=new M(s,this.memory,i.textures),this.renderer.statues=t.picture.renderer.statues}settle(){let{walk:t,memory:s}=this,{client:r,client:{catalogue:e},needs:{present:i},stream:{estimate:o}}=t,{T:n,K:a,levels:l,stored:m,ends:c,previews:{first:E,column:p,loss:x}}=e;if(!i)return!1;let g=new Int32Array(n),v=new Float64Array(n),w=new Float64Array(n),{downloads:y}=r,T=Math.max(8e3,.2*o.bandwidth/8),A=[];for(let f=0;f<n;f++){v[f]=i[f*a+1];let d=l[f],u=-1;for(;d>0&&!(i[f*a+d]>0);)d--;g[f]=Math.min(d,y.reach(f).last),w[f]=y.loss(f,g[f]);for(let b=E[f];d>m[f]&&b<E[f+1];b++)p[b]>=d&&(u<0||x[b]<x[u])&&(u=b);let S=u<0?0:x[u];(s.held[f]<d||d>0&&s.loss[f]>S)&&A.push({texture:f,end:c[f*a+d],preview:u})}s.settle(g,v,w),A.sort((f,d)=>v[d.texture]-v[f.texture]);for(let{texture:f,end:d,preview:u}of A){if(!K(o,y.waiting))break;if(u>=0){y.free("preview",u)&&t.stream.ask(y.ask("preview",u,v[f]));continue}let S=Math.min(d,Math.floor(y.bytes[f]+T));S<=y.bytes[f]||!y.free("texture",f)||t.stream.ask(y.ask("texture",f,v[f],S))}return A.length===0}delete(){this.memory.delete(),this.renderer.delete()}};export{V as Comparison};
