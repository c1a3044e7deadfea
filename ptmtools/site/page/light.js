var N=`
vec3 linear(vec3 color){
vec3 curve=color*(color*(color*(color*-0.11677+0.52647)+0.5604)+0.0284)+0.00105;
return mix(curve,color/12.92,lessThanEqual(color,vec3(0.04045)));
}`,b=(i="0.8")=>`
vec3 developed(vec3 light){
float most=max(light.r,max(light.g,light.b));
if(most > ${i}){
float peak=1.0-0.04/(most-0.6);
light=mix(light*(peak/most),vec3(peak),1.0-1.0/(0.15*(most-peak)+1.0));
}
light=min(light,1.0);
vec3 root=sqrt(light),curve=0.29812*sqrt(root)+0.83374*root-0.05531*light-0.07691;
return mix(curve,12.92*light,lessThanEqual(light,vec3(0.0031308)));
}`,k=i=>`
layout(location=3)in vec2 place2;
out vec2 spot;
uniform float white;${i?`
layout(location = 5) in vec3 normal;
out vec3 bent;
out vec3 away;`:""}
void main() {
  spot = place2;${i?`
  bent = normal;
  away = position - eye;`:""}`,A=`
in vec3 bent;
in vec3 away;
uniform vec3 eye;
uniform vec3 centre;
uniform vec3 low;
uniform vec3 high;
uniform vec2 polish;
uniform vec2 power;
uniform sampler2D probe;
uniform vec3 haze;
vec3 way;
vec2 part;
vec3 stored(vec2 place,float level){
vec2 corner=vec2(level < 1.0?0.0:level < 3.0?128.0:160.0,level < 2.0?0.0:64.0);
return textureLod(probe,(corner+1.0+place*(exp2(7.0-level)-2.0))/vec2(192.0,128.0),0.0).rgb;
}
vec3 seenAlong(vec3 ray,float rough){
vec3 share=haze;
if(share.r < 0.0){
ray/=abs(ray.x)+abs(ray.y)+abs(ray.z);
vec2 place=ray.xz;
if(ray.y < 0.0)place=(1.0-abs(ray.zx))*mix(vec2(-1.0),vec2(1.0),greaterThanEqual(place,vec2(0.0)));
float level=min(floor(3.0*rough),2.0);
place=place*0.5+0.5;
share=mix(stored(place,level),stored(place,level+1.0),3.0*rough-level);
}
return power.x*exp2(stops*(share-1.0));
}
void meet(){
vec3 normal=dot(bent,bent)> 0.0?bent:cross(dFdx(away),dFdy(away));
vec3 ray=normalize(away);
normal*=inversesqrt(max(dot(normal,normal),1e-36));
way=reflect(ray,normal);
vec3 at=eye+away,ends=max((high-at)/way,(low-at)/way);
way=at+way*max(0.0,min(ends.x,min(ends.y,ends.z)))-centre;
vec4 k=polish.y*vec4(-1.0,-0.0275,-0.572,0.022)+vec4(1.0,0.0425,1.04,-0.04);
float share=min(k.x*k.x,exp2(-9.28*max(abs(dot(normal,ray)),0.001)))*k.x+k.y;
part=vec2(-1.04,1.04)*share+k.zw;
}
vec3 reflected(vec3 base,vec3 light){
meet();
vec3 share=mix(vec3(0.04),base,polish.x)*part.x+part.y,image=seenAlong(way,polish.y);
image*=mix(1.0,min(1.0,dot(light,vec3(0.2126,0.7152,0.0722))/power.y),polish.y);
image=mix(image,light,smoothstep(0.2,0.8,polish.y))*share;
return base*light*(1.0-polish.x)*(1.0-max(share.r,max(share.g,share.b)))+image;
}`,S=`
if(white==0.0){
meet();
float share=0.04*part.x+part.y;
share*=1.9-0.9*share;
vec3 behind=seenAlong(away,1.0),image=developed(behind*(1.0-share)+seenAlong(way,polish.y)*share);
shown.rgb*=shown.a*(1.0-share);
shown.rgb+=max(image-(1.0-share)*developed(behind),0.0);
shown.a+=share*(1.0-shown.a);
}
`,z=({stops:i,tone:e},o)=>`
const float stops=float(${i});
in vec2 spot;
uniform float white;
uniform sampler2D lightmap;
uniform vec3 code;
${N}
${b(e==="plain"?"1e30":void 0)}
${o?A:""}
vec3 display(vec3 texel){
if(white==0.0)return texel*color.rgb*painted;
vec3 share=code.r < 0.0?texture(lightmap,spot).rgb:code;
${o?"  return developed(reflected(linear(texel)*color.rgb*painted,white*exp2(stops*(share-1.0))));":"  return developed(linear(texel)*color.rgb*painted*white*exp2(stops*(share-1.0)));"}
}
void main`,I=`#version 300 es
precision highp float;
uniform mat3 turn;
uniform vec4 lens;
out vec3 way;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1)*4.0-1.0;
way=inverse(turn)*vec3(corner/lens.xy,-1.0);
gl_Position=vec4(corner,1.0,1.0);
}`,R=`#version 300 es
precision highp float;
in vec3 way;
uniform vec3 sky;
uniform vec3 ground;
out vec4 shown;
${b()}
void main(){
shown=vec4(developed(mix(ground,sky,smoothstep(-0.02,0.02,normalize(way).y))),1.0);
}`,w=class{exposure=1;#r=[];#o=0;#e=!0;#i=null;#a=null;#t=new WeakMap;constructor(e,o){this.row=e,this.probes=o.map(({probe:t})=>{let{white:r,mean:l,centre:c,low:h,high:a}=t??{};return[r,l,...[c,h,a].flat()].every(Number.isFinite)?t:void 0})}sources([e,o],t=!1){if(!o.includes("painted"))return[e,o];let r=o.replace(/sampled\.rgb ?\* ?color\.rgb ?\* ?painted/,"display(sampled.rgb)");return[e.replace(/void main\(\) ?{/,k(t)).replace(/painted ?= ?paint\.rgb/,"painted = white > 0.0 ? pow(paint.rgb, vec3(4.0)) : paint.rgb"),r.replace("void main",z(this.row,t)).replace(/if ?\(shown\.a/,`${t?S:""}$&`).replace(/glow ?= ?0\.25/,"glow = white > 0.0 ? 1.0 : 0.7")]}illuminate(e){e.light=this,e.gl.deleteProgram(e.surface.program),e.surface=e.compile("surface")}adapt({cell:e,client:{known:o},index:{cells:t},memory:{fades:r},picture:l},c,h){let{exposure:a,row:{tone:u}}=this,n=e<0||u==="plain"?a:t[e].exposure??1;this.#e||=!(Math.hypot(...c.map((v,f)=>v-this.#r[f]))<1);let s=this.#e||!r?1:(a/n)**Math.exp((this.#o-h)/.2);this.exposure=Math.abs(Math.log(s))<.01?n:n*s,this.#e&&=!o[e],this.#o=h,this.#r=[...c],this.exposure!==a&&l.touch()}mirrorOf(e,{probe:o}){return!this.probes[o]||this.row.tone==="plain"?null:this.#a??=e.compile("mirror",void 0,!0)}paint({gl:e,memory:o,means:t},r,l,c){let{white:h,light:a,probe:u,extras:n}=l,{exposure:s,probes:{[u]:v}}=this;e.uniform1f(r.white,h*s);let f=(m,p,d,E,x)=>{let g=m<0?null:o.of(m),y=g&&g.levels>=p;if(e.uniform3fv(r[d],y?[-1,-1,-1]:t[m]??[1,1,1]),!y)return!1;e.activeTexture(e.TEXTURE0+x);let T=g.bind(!0,!0,p?1/0:c);return p&&e.texParameteri(e.TEXTURE_2D,e.TEXTURE_MIN_FILTER,e.LINEAR),e.activeTexture(e.TEXTURE0),e.uniform1i(r[E],x),T};if(v&&r.polish){let m=this.#t.get(l);if(!m){let{metallicFactor:p=0,roughnessFactor:d=1}=JSON.parse(n);this.#t.set(l,m=[p,d])}e.uniform2fv(r.polish,m),e.uniform2f(r.power,v.white*s,Math.max(v.mean*s,1e-30));for(let p of["centre","low","high"])e.uniform3fv(r[p],v[p]);f(u,o.rows[u].sizes.length,"haze","probe",3)}return f(a,0,"code","lightmap",1)}surround(e,{turn:o,lens:t}){let{gl:r}=e,{row:{tone:l,sky:c=[],ground:h=[]},exposure:a}=this;if(l==="plain")return;let{program:u,at:n}=this.#i??=e.compile("surroundings",[I,R]);r.useProgram(u),r.uniformMatrix3fv(n.turn,!1,o),r.uniform4fv(n.lens,t),r.uniform3fv(n.sky,c.map(s=>s*a)),r.uniform3fv(n.ground,h.map(s=>s*a)),r.bindVertexArray(null),r.depthFunc(r.LEQUAL),r.drawArrays(r.TRIANGLES,0,3),r.depthFunc(r.LESS)}};function U({comparison:i,index:e,picture:{renderer:o}}){if(!e.light)return;let t=new w(e.light,e.textures);t.illuminate(o),i&&t.illuminate(i.renderer)}export{w as Light,U as show};
