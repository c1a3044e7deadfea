function $({texture:n,factor:t,blends:e,cutoff:s,twoSided:o,extras:r}){return[n,t,e,s,o,r].join()}function*U(n){let t=new Map;for(let u of n){let p=$(u),T=t.get(p);T?T.push(u):t.set(p,[u])}let e=n.reduce((u,{positions:p})=>u+p.length/3,0),s=n.reduce((u,{indices:p})=>u+p.length,0),o=n.some(({spots:u})=>u),r=n.some(({colors:u})=>u),h=n.some(({normals:u})=>u),i=5+2*+o,a=i+ +h+ +r,l=new Float32Array(a*e),f=new Uint8Array(l.buffer),d=e>65535?new Uint32Array(s):new Uint16Array(s),x=[],g=0,v=0;for(let u of t.values()){let p=v,[T]=u,{factor:w,white:_}=T;for(let{positions:c,uvs:m,colors:y,spots:S,normals:b,indices:F}of u){yield;for(let A=0;A<F.length;A++)A%16384===16383&&(yield),d[v++]=g+F[A];for(let A=0;A<c.length/3;A++,g++){A%16384===16383&&(yield);for(let E=0;E<3;E++)l[a*g+E]=c[3*A+E],b&&(f[4*(a*g+i)+E]=b[3*A+E]);for(let E=0;r&&E<4;E++)f[4*(a*(g+1)-1)+E]=y?255*J(y[4*A+E]/65535,_)+.5:255;for(let E=0;E<2;E++)m&&(l[a*g+3+E]=m[2*A+E]),S&&(l[a*g+5+E]=S[2*A+E])}}let R=_?w:[...w.slice(0,3).map(k),w[3]];for(let c=p;c<v;c+=6144){let m=d.subarray(c,Math.min(c+6144,v)),y=q(m,l,a);x.push({look:T,first:c*d.BYTES_PER_ELEMENT,count:m.length,color:R,...y}),yield}}return{data:l,lit:o,curved:h,painted:r,index:d,batches:x}}function q(n,t,e){let s=[1/0,1/0,1/0],o=[-1/0,-1/0,-1/0];for(let r=0;r<n.length;r++)for(let h=0,i=e*n[r];h<3;h++,i++)t[i]<s[h]&&(s[h]=t[i]),t[i]>o[h]&&(o[h]=t[i]);return{low:s,high:o}}var N=class{constructor(t,{data:e,lit:s,curved:o,painted:r,index:h,batches:i},a){this.gl=t,this.shapes=a,this.batches=i,this.bytes=e.byteLength+h.byteLength,this.type=h instanceof Uint32Array?t.UNSIGNED_INT:t.UNSIGNED_SHORT,this.vertexArray=t.createVertexArray(),this.buffers=[t.createBuffer(),t.createBuffer()],t.bindVertexArray(this.vertexArray),t.bindBuffer(t.ARRAY_BUFFER,this.buffers[0]),t.bufferData(t.ARRAY_BUFFER,e,t.STATIC_DRAW),t.bindBuffer(t.ELEMENT_ARRAY_BUFFER,this.buffers[1]),t.bufferData(t.ELEMENT_ARRAY_BUFFER,h,t.STATIC_DRAW);let l=s?28:20,f=l+4*+o,d=f+4*+r,x=(g,v,u,p=t.FLOAT)=>{t.enableVertexAttribArray(g),t.vertexAttribPointer(g,v,p,p!==t.FLOAT,d,u)};x(0,3,0),x(1,2,12),t.vertexAttrib4f(2,1,1,1,1),r&&x(2,4,f,t.UNSIGNED_BYTE),s&&x(3,2,20),o&&x(5,3,l,t.BYTE),t.bindVertexArray(null)}draw(t){this.gl.drawElements(this.gl.TRIANGLES,t.count,this.type,t.first)}delete(){this.gl.deleteVertexArray(this.vertexArray);for(let t of this.buffers)this.gl.deleteBuffer(t)}},J=(n,t)=>t?n**.25:k(n);function k(n){return n<=.0031308?12.92*n:1.055*n**(1/2.4)-.055}function P(n,t,e){let s=n.createProgram(),o=[n.VERTEX_SHADER,n.FRAGMENT_SHADER];if(e.forEach((i,a)=>{let l=n.createShader(o[a]);n.shaderSource(l,i),n.compileShader(l),n.attachShader(s,l),n.deleteShader(l)}),n.linkProgram(s),!n.getProgramParameter(s,n.LINK_STATUS)&&!n.isContextLost())throw new Error(`${t}: ${n.getProgramInfoLog(s)}`);let r={},h=n.isContextLost()?0:n.getProgramParameter(s,n.ACTIVE_UNIFORMS);for(let i=0;i<h;i++){let a=n.getActiveUniform(s,i)?.name??"";r[a]=n.getUniformLocation(s,a)}return{program:s,at:r}}function B(n,{program:t,at:e},s){n.useProgram(t),n.uniform3fv(e.eye,s.eye),n.uniformMatrix3fv(e.turn,!1,s.turn),n.uniform4fv(e.lens,s.lens)}var D=(n="",t="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${n}
void main(){
${t}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,Q=`
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
}`,Z=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
uniform float cutoff;
out vec4 shown;
${Q}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,G=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,tt=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${G}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,et=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${G}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,H=[D(),Z],xt=[D(),tt],yt=[D(),et];var M=class{cells=new Map;#t=new Map;#e=null;constructor(t,e,s){this.gl=t,this.memory=e,this.means=s.map(({color:o})=>o.map(r=>r/255)),this.light=null,this.surface=this.compile("surface"),this.statues=null}add(t,e,s){let o=this.#t.get(t)??{shapes:e,steps:U(e)};this.#t.set(t,o);let{steps:r}=o,h=r.next();for(;!h.done;){if(s())return!1;h=r.next()}return this.#t.delete(t),this.cells.get(t)?.delete(),this.cells.set(t,new N(this.gl,h.value,o.shapes)),!0}keep(t){for(let[e,s]of this.cells)t.has(e)||(s.delete(),this.cells.delete(e));for(let e of this.#t.keys())t.has(e)||this.#t.delete(e)}compile(t,e=H,s){return P(this.gl,t,this.light?.sources(e,s)??e)}delete(){this.keep(new Set),this.gl.deleteProgram(this.surface.program)}get bytes(){let t=0;for(let{bytes:e}of this.cells.values())t+=e;return t}draw(t,e,s){let{gl:o}=this;o.clearColor(.16,.17,.19,1),o.depthMask(!0),o.clear(o.COLOR_BUFFER_BIT|o.DEPTH_BUFFER_BIT),o.enable(o.DEPTH_TEST),o.disable(o.BLEND),this.#e=null;let r=!1,h=[],i=[];for(let{buffers:a,batches:l}of e){o.bindVertexArray(a.vertexArray);for(let f of l)f.look.blends?h.push({buffers:a,batch:f,far:st(t.eye,f)}):this.statues?.has(f.look)?i.push({buffers:a,batch:f}):r=this.#s(t,a,f,s)||r}if(i.length){let a=(l,f)=>this.#r(l,f,s);r=this.statues?.draw(t,i,a,s)||r}if(this.light?.surround(this,t),this.#e=null,h.length){o.enable(o.BLEND),o.depthMask(!1);for(let{buffers:a,batch:l}of h.sort((f,d)=>d.far-f.far))o.bindVertexArray(a.vertexArray),r=this.#s(t,a,l,s)||r}return o.bindVertexArray(null),r}#s(t,e,s,o){let{gl:r}=this,{look:h}=s,i=this.light?.mirrorOf(this,h),a=i??this.surface;a!==this.#e&&B(r,this.#e=a,t);let l=i&&!h.white?r.ONE:r.SRC_ALPHA;r.blendFuncSeparate(l,r.ONE_MINUS_SRC_ALPHA,r.ONE,r.ONE_MINUS_SRC_ALPHA);let f=this.#r(a.at,s,o);return e.draw(s),f}#r(t,e,s){let{gl:o}=this,{texture:r,clampU:h,clampV:i,cutoff:a,twoSided:l}=e.look;(l?o.disable:o.enable).call(o,o.CULL_FACE),o.uniform4fv(t.color,e.color),o.uniform1f(t.cutoff,a),o.uniform1i(t.textured,+(r>=0));let f=r<0?null:this.memory.of(r);o.uniform1i(t.channels,f?.channels??0),r>=0&&o.uniform3fv(t.mean,this.means[r]);let d=this.light?.paint(this,t,e.look,s);return f?.bind(h,i,s)||d}};function st(n,{low:t,high:e}){return Math.hypot(...n.map((s,o)=>(t[o]+e[o])/2-s))}function X(n,t,e){if(!e)return n;let s=new Uint8ClampedArray(n),o=t-+(t>1);for(let r=0;r<s.length;r+=t)for(let h=r;h<r+o;h++)s[h]+=e;return new Uint8Array(s.buffer)}var rt=37446;function Y(n){return n.getContextAttributes()?.antialias&&n.getExtension("WEBGL_debug_renderer_info")&&!/Swift|llvm|Basic/.test(n.getParameter(rt))}var ot=262144,it=.3,nt=4,ht=34046;function K(n,t){return t===1?{inside:n.R8,outside:n.RED}:t===2?{inside:n.RG8,outside:n.RG}:{inside:n.RGBA8,outside:n.RGBA}}var O=class{#t=0;#e=0;#s=-1;constructor(t,e,s){this.gl=t,this.sizes=e,this.channels=s,this.texture=t.createTexture(),this.bytes=e.reduce((h,{width:i,height:a})=>h+i*a*s,0);let{width:o,height:r}=e[e.length-1];t.bindTexture(t.TEXTURE_2D,this.texture),t.texStorage2D(t.TEXTURE_2D,e.length,K(t,s).inside,o,r),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.LINEAR_MIPMAP_LINEAR),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.LINEAR)}get levels(){return this.sizes.length}upload(t,e,s,o){let{gl:r,channels:h}=this,{width:i,height:a}=this.sizes[t],l=Math.min(a-s,Math.max(1,Math.floor(ot/(i*h)))),f=e.subarray(s*i*h,(s+l)*i*h);return r.bindTexture(r.TEXTURE_2D,this.texture),r.pixelStorei(r.UNPACK_ALIGNMENT,1),r.texSubImage2D(r.TEXTURE_2D,this.levels-1-t,0,s,i,l,K(r,h).outside,r.UNSIGNED_BYTE,X(f,h,o)),s+l}fadeIn(t,e){this.#t=t,this.#e=e}bind(t,e,s,o){let{gl:r}=this,h=+t+2*+e;if(r.bindTexture(r.TEXTURE_2D,this.texture),h!==this.#s){let[a,l]=[t,e].map(f=>f?r.CLAMP_TO_EDGE:r.REPEAT);r.texParameteri(r.TEXTURE_2D,r.TEXTURE_WRAP_S,a),r.texParameteri(r.TEXTURE_2D,r.TEXTURE_WRAP_T,l),this.#s=h,!o&&Y(r)&&r.getExtension("EXT_texture_filter_anisotropic")&&r.texParameterf(r.TEXTURE_2D,ht,nt)}if(!this.#t)return!1;let i=this.#t*Math.max(0,1-(s-this.#e)/it);return r.texParameterf(r.TEXTURE_2D,r.TEXTURE_MIN_LOD,i>0?i:-1e3),i===0&&(this.#t=0),i>0}delete(){this.gl.deleteTexture(this.texture)}};var at=3,lt=6,L=class{images=null;loss=0;storage=null;level=0;row=0;constructor(t,e){this.texture=t,this.to=e,this.inside=!1}},I=class{#t;#e=new Map;#s=new Int32Array(0);#r=new Float64Array(0);#i;#o;constructor(t,e,s){this.gl=t,this.rows=e,this.decode=s,this.#t=e.map(()=>null),this.held=new Int32Array(e.length),this.loss=new Float64Array(e.length),this.#i=new Float64Array(e.length),this.#o=new Int32Array(e.length),this.budget=1/0,this.bytes=0,this.peak=0,this.fades=!0}of(t){return this.#t[t]}settle(t,e,s){this.#s=t,this.#i=s,this.#o.fill(0),this.#r=e;for(let i=0;i<t.length;i++)t[i]===0&&this.held[i]&&this.#a(i);let o=[...t.keys()].filter(i=>this.held[i]>t[i]);o.sort((i,a)=>e[i]-e[a]);let r=[...this.#e.values()].some(({storage:i,inside:a})=>i&&!a),h=Math.min(...o.map(i=>this.#c(i,t[i])));for(let i of o){if(this.bytes<=this.budget&&(r||this.bytes+h<=this.budget))break;this.#a(i)}this.#n()}hold(){this.#s=this.held.map((t,e)=>Math.max(t,Math.min(this.#s[e]??0,this.#o[e]))),this.#i=this.loss.slice()}resume(){this.#n()}#u(t,e){let s=-1;for(let o=0;o<this.rows.length;o++)t(o)&&(s<0||e(o)>e(s))&&(s=o);return s}#d(t){return this.held[t]>0&&this.held[t]===this.#s[t]&&this.#i[t]<this.loss[t]}#l(t){let e=this.held[t],s=this.#s[t];return s<e?2:e===0?1:s>e?0:-1}#n(){let{held:t}=this,e=this.#s,s=this.#r;for(;;){let o=[...this.#e.values()];if(o.filter(({images:a})=>!a).length>=at)return;let r=o.length<lt,h=this.#u(a=>e[a]>0&&!this.#e.has(a)&&(e[a]<t[a]||r&&(e[a]>t[a]||this.#d(a))),a=>s[a]+this.#l(a));if(h<0)return;let i=new L(h,e[h]);this.#e.set(h,i),this.decode(h,e[h]).then(({images:a,loss:l})=>{Object.assign(i,{images:a,loss:l}),this.#n()},()=>this.#h(i))}}#h(t){this.#e.get(t.texture)===t&&(t.storage&&!t.inside&&this.#f(t.storage),this.#e.delete(t.texture))}#a(t){let e=this.#t[t];e&&this.#f(e),this.#t[t]=null,this.held[t]=0}pump(t,e){let s=!1,o=[...this.#e.values()];o.sort((r,h)=>this.#l(h.texture)-this.#l(r.texture));for(let r of o){for(;!e()&&this.#m(r,t);)s=!0;if(e())break}return s&&this.#n(),s}#m(t,e){let{texture:s,to:o,images:r,loss:h}=t,i=this.held[s],{offsets:a}=this.rows[s];if(!r||this.#e.get(s)!==t)return!1;let l=this.#s[s],f=o===i&&h<this.loss[s];if(l===0||o>l||o<=i&&l>=i&&!f)return this.#h(t),!1;t.storage||(t.inside=f,t.storage=f?this.#t[s]:this.#p(s,o));let{storage:d}=t;if(!d||t.inside&&d!==this.#t[s])return d&&this.#h(t),!1;let{level:x,row:g}=t,{data:v,height:u}=r[x];return t.row=d.upload(x,v,g,a[x]),t.row>=u&&(t.row=0,t.level++),t.level<o||(this.#e.delete(s),this.loss[s]=h,t.inside)||(this.#a(s),this.#t[s]=d,this.held[s]=o,this.fades&&i>0&&o>i&&d.fadeIn(o-i,e)),!0}#p(t,e){let{sizes:s,channels:o}=this.rows[t],r=this.#c(t,e),h=e<this.held[t]?0:this.#E();return this.bytes+r+h>this.budget?null:(this.bytes+=r,this.peak=Math.max(this.peak,this.bytes),new O(this.gl,s.slice(0,e),o))}#c(t,e){let{sizes:s,channels:o}=this.rows[t];return s.slice(0,e).reduce((r,h)=>r+h.width*h.height*o,0)}#E(){return this.#s.reduce((t,e,s)=>e<this.held[s]?Math.max(t,this.#c(s,e)):t,0)}#f(t){this.bytes-=t.bytes,t.delete()}delete(){this.#s=new Int32Array(this.rows.length);for(let t of[...this.#e.values()])this.#h(t);for(let t=0;t<this.rows.length;t++)this.#a(t)}lose(){this.#o=this.held.map((t,e)=>Math.max(t,this.#o[e])),this.#t.fill(null),this.#e.clear(),this.held.fill(0),this.bytes=0}};function W(n,t){let e=0,s=0;for(let r of t)e+=Math.max(r.left,0),s+=+!r.waits;let o=n.latency+.2/2;return s<n.concurrency&&(e===0||8*e<o*n.bandwidth)}var j=class{constructor(t){let{gl:e,rows:s,stream:o,index:r}=t;this.walk=t,this.memory=new I(e,s,(a,l)=>o.decode(a,l)),this.memory.fades=!1,this.renderer=new M(e,this.memory,r.textures);let{light:h,statues:i}=t.picture.renderer;h?.illuminate(this.renderer),this.renderer.statues=i}settle(){let{walk:t,memory:e}=this,{client:s,client:{catalogue:o},needs:{present:r},stream:{estimate:h}}=t,{T:i,K:a,levels:l,stored:f,ends:d,previews:{first:x,column:g,loss:v}}=o;if(!r)return!1;let u=new Int32Array(i),p=new Float64Array(i),T=new Float64Array(i),{downloads:w}=s,_=Math.max(8e3,.2*h.bandwidth/8),R=[];for(let c=0;c<i;c++){p[c]=r[c*a+1];let m=l[c],y=-1;for(;m>0&&!(r[c*a+m]>0);)m--;u[c]=Math.min(m,w.reach(c).last),T[c]=w.loss(c,u[c]);for(let b=x[c];m>f[c]&&b<x[c+1];b++)g[b]>=m&&(y<0||v[b]<v[y])&&(y=b);let S=y<0?0:v[y];(e.held[c]<m||m>0&&e.loss[c]>S)&&R.push({texture:c,end:d[c*a+m],preview:y})}e.settle(u,p,T),R.sort((c,m)=>p[m.texture]-p[c.texture]);for(let{texture:c,end:m,preview:y}of R){if(!W(h,w.waiting))break;if(y>=0){w.free("preview",y)&&t.stream.ask(w.ask("preview",y,p[c]));continue}let S=Math.min(m,Math.floor(w.bytes[c]+_));S<=w.bytes[c]||!w.free("texture",c)||t.stream.ask(w.ask("texture",c,p[c],S))}return R.length===0}delete(){this.memory.delete(),this.renderer.delete()}};export{j as Comparison};
