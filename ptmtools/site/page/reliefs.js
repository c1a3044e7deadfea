var G=()=>import("./statues.js");function C({texture:r,factor:e,blends:o,cutoff:t,twoSided:a,extras:n}){return[r,e,o,t,a,n].join()}var H=(r,e)=>e?r**.25:oe(r);function oe(r){return r<=.0031308?12.92*r:1.055*r**(1/2.4)-.055}function W(r,{program:e,at:o},t){r.useProgram(e),r.uniform3fv(o.eye,t.eye),r.uniformMatrix3fv(o.turn,!1,t.turn),r.uniform4fv(o.lens,t.lens)}var S=(r="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${r}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,D=`
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
}`,re=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
uniform float cutoff;
out vec4 shown;
${D}
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
}`,$=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,ne=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${$}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,se=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${$}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,j=[S(),re],we=[S(),ne],ve=[S(),se];var N=class extends Error{constructor(e,o){super(o),this.code=e}};var ae=[.5,.7,.6].map(r=>r/Math.hypot(.5,.7,.6)),P=`
float lit(vec3 normal){
float along=(1.0+dot(normal,vec3(${ae.join()})))/2.0;
return ${.3}+${1-.3}*along*along;
}`;function Y(r,e,o,t=0,a=t){let n=0;for(let s=0;s<3;s++){let i=Math.max(e[t+s]-r[s],r[s]-o[a+s],0);n+=i*i}return Math.sqrt(n)}function X(r,e){let{T:o,K:t,gains:a,previews:{first:n}}=r;if(!q.has(a)){q.add(a);for(let s=0;s<o;s++)if(e[s].normals)for(let[i,c]of[[s,s+1],[o+n[s],o+n[s+1]]])for(let d=i*t;d<c*t;d++)a[d]*=.25}}var q=new WeakSet;var ce=(r,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[r]);var U=ce("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."});var Le=Promise.resolve();var K=(r,e)=>r.replace(/\{(\w+)\}/g,(o,t)=>e[t]);var J=[2,3,4],O=33071,le={normalWrapS:O,normalWrapT:O},fe=.1,ue=S(`
layout(location=4)in vec2 second;
layout(location=5)in vec3 up;
layout(location=6)in vec4 right;
out vec2 at;
out mat3 axes;`,"at = second; axes = mat3(right.xyz, right.w * cross(up, right.xyz), up);"),de=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec2 at;
in mat3 axes;
uniform sampler2D relief;
uniform float cutoff;
out vec4 shown;
${D}
${P}
void main(){
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(axes*(texture(relief,at).rgb*2.0-1.0));
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,he=P.replace("lit","lamplight"),Z=[S(`
layout(location = 4) in vec2 second;
out vec2 at;`,"at = second;"),j[1].replace("out vec4 shown;",`out vec4 shown;
uniform mat3 turn;
uniform sampler2D relief;
uniform float scale;
in vec2 at;
${he}`).replace(/shown ?= ?vec4/,`
vec3 a=dFdx(seen),b=dFdy(seen);
vec2 p=dFdx(at),q=dFdy(at);
float side=sign(p.x*q.y-p.y*q.x);
vec3 up=normalize(cross(a,b)),right=(a*q.y-b*p.y)*side,over=(a*q.x-b*p.x)*side;
if(dot(right,right)> 0.0){
vec3 tilt=texture(relief,at).rgb*2.0-1.0;
right=normalize(right);
vec3 across=cross(up,right);
if(dot(across,over)< 0.0)across=-across;
vec3 normal=scale*(right*tilt.x+across*tilt.y)+up*tilt.z;
light*=lamplight(normalize(normal)*turn)/lamplight(up*turn);
}
$&`)],I=class{#e=new Map;#i=new WeakMap;#c=new WeakMap;#o=new WeakSet;#r=!1;constructor(e){let{gl:o,picture:{renderer:t}}=e;this.gl=o,this.walk=e,this.program=t.compile("relief",[ue,de]),this.bumps=t.compile("bumps",Z);let{light:a}=t;this.mirrors=a?.probes.some(Boolean)?t.compile("bumps",Z,!0):this.bumps,X(e.client.catalogue,e.index.textures)}delete(){for(let e of this.#e.keys())this.#a(e)}has(e){return this.walk.memory.held[e.relief]>0&&this.#n(e)}#n(e){let{relief:o,frames:t,positions:a}=e;if(o<0||this.#o.has(e))return!1;let n=a.length/3,s=t?.every((d,l)=>d.length===J[l]*n),i=L(e)?1:J.length,c=this.walk.index.textures[o];return s&&t?.length===i&&c&&(i===1||c.relief!==void 0)?!0:(this.#o.add(e),this.walk.report(new N("PTM-V105",K(U.relief,{name:e.name||U.object}))),!1)}get lacks(){return!this.#r}get levels(){let{index:{textures:e},memory:{held:o}}=this.walk;return e.flatMap(({relief:t,normals:a},n)=>a||t!==void 0?[o[n]]:[])}advance(e,o,t){this.#l();let{gl:a,walk:{client:n,client:{catalogue:{K:s,levels:i}},needs:{present:c}}}=this;if(!c)return;let d=a.drawingBufferWidth*a.drawingBufferHeight,l=!1,x=new Map;for(let{batches:u}of e)for(let{look:f,low:w,high:p}of u){let{relief:h,blends:y,texture:m}=f;if(y||!this.#n(f))continue;if(L(f)&&m>=0){let A=Math.log2(this.#t(f)/this.#t(f,m)),E=`${h} ${m}`,_=x.get(E)??new Float64Array(s);x.set(E,_);for(let k=1;k<=i[h];k++){let B=Math.max(1,i[m]-i[h]+k+A),F=Math.floor(B),[V,te]=[F,F+1].map(z=>z<s?c[m*s+z]:0);_[k]=Math.max(_[k],V+(B-F)*(te-V))}continue}let v=t/2/Math.max(fe,Y(o,w,p)),[b,T,R]=w.map((A,E)=>p[E]-A),M=Math.min(1,v*v*T*Math.max(b,R)/d),ee=Math.max(0,Math.floor(Math.log2(this.#t(f)/v)));for(let A=1,E=h*s+1;A<=Math.max(1,i[h]-ee);A++,E++)c[E]>=M||(c[E]=M,l=!0)}let g=new Map;for(let[u,f]of x){let w=parseInt(u)*s;f.forEach((p,h)=>g.set(w+h,(g.get(w+h)??0)+p))}for(let[u,f]of g)c[u]>=f||(c[u]=f,l=!0);l&&n.sees(c,n.hidden),this.#r=!0}#l(){if(!this.#e.size)return;let{cells:e}=this.walk.picture.renderer,o=new Set([...e.values()].flatMap(({shapes:t})=>t));for(let t of this.#e.keys())o.has(t)||this.#a(t)}#t(e,o){let t=o===void 0?this.#i:this.#c,a=t.get(e);if(a)return a;let{positions:n,indices:s,relief:i,frames:c,uvs:d}=e,l=o===void 0?c?.[0]:d,{width:x,height:g}=this.walk.index.textures[o??i],u=0,f=0;for(let p=0;p<s.length;p+=3){let[h,y,m]=s.subarray(p,p+3);u+=Q(n,3,h,y,m),f+=Q(l,2,h,y,m)}let w=u*f>0?Math.sqrt(f*x*g/u):1;return t.set(e,w),w}draw(e,o,t,a){let{gl:n,walk:s}=this;for(let d of[this.program,this.bumps,this.mirrors])W(n,d,e),n.uniform1i(d.at.relief,2);let i=!1,c=new Set;for(let{buffers:d,batch:l}of o){if(c.has(l.look))continue;c.add(l.look);let{relief:x,extras:g}=l.look,u=L(l.look),{normalScale:f=1,normalWrapS:w,normalWrapT:p}=u?JSON.parse(g):le,h=w===O,y=p===O,v=u&&s.picture.renderer.light?.mirrorOf(s.picture.renderer,l.look)?this.mirrors:u?this.bumps:this.program;n.useProgram(v.program),n.uniform1f(v.at.scale,f),n.activeTexture(n.TEXTURE2),i=s.memory.of(x)?.bind(h,y,a)||i,n.activeTexture(n.TEXTURE0),i=t(v.at,l)||i;let b=C(l.look);for(let T of d.shapes){if(C(T)!==b)continue;let{array:R,count:M}=this.#f(T);n.bindVertexArray(R),n.drawElements(n.TRIANGLES,M,n.UNSIGNED_INT,0)}}return i}#f(e){let o=this.#e.get(e);if(o)return o;let{gl:t}=this,{positions:a,uvs:n,colors:s,indices:i,frames:c,spots:d,normals:l,white:x}=e,g=t.createVertexArray(),u=i.length;t.bindVertexArray(g);let f=[],[w,p,h=null]=c,y=s&&Float32Array.from(s,b=>H(b/65535,x)),m=[[0,a,3],[1,n,2],[2,y,4],[3,d,2],[4,w,2]];L(e)?m.push([5,l&&Float32Array.from(l),3]):m.push([5,p,3],[6,h,4]);for(let[b,T,R]of m)T&&(f.push(this.#s(t.ARRAY_BUFFER,T)),t.enableVertexAttribArray(b),t.vertexAttribPointer(b,R,t.FLOAT,!1,0,0));t.vertexAttrib4f(2,1,1,1,1),f.push(this.#s(t.ELEMENT_ARRAY_BUFFER,Uint32Array.from(i))),t.bindVertexArray(null);let v={array:g,buffers:f,count:u};return this.#e.set(e,v),v}#s(e,o){let{gl:t}=this,a=t.createBuffer();return t.bindBuffer(e,a),t.bufferData(e,o,t.STATIC_DRAW),a}#a(e){let o=this.#e.get(e);if(o){this.gl.deleteVertexArray(o.array);for(let t of o.buffers)this.gl.deleteBuffer(t);this.#e.delete(e)}}},L=({extras:r})=>r.includes("normalCoords");function Q(r,e,o,t,a){let n=g=>[0,1,2].map(u=>u<e?r[e*g+u]-r[e*o+u]:0),[s,i,c]=n(t),[d,l,x]=n(a);return Math.hypot(i*x-c*l,c*d-s*x,s*l-i*d)}async function We(r){r.index.octrees&&(await G()).show(r);let{picture:{renderer:e}}=r,o=new I(r),{statues:t}=e;e.statues=t?pe(t,o):o}function pe(r,e){return{delete(){r.delete(),e.delete()},has:o=>r.has(o)||e.has(o),get lacks(){return r.lacks||e.lacks},get levels(){return r.levels},get bytes(){return r.bytes},advance(o,t,a,n){r.advance(o,t,a,n),e.advance(o,t,a)},draw(o,t,a,n){let s=({batch:c})=>r.has(c.look),i=r.draw(o,t.filter(s),a,n);return e.draw(o,t.filter(c=>!s(c)),a,n)||i}}}export{We as show};
